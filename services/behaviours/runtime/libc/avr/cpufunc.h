#ifndef KILOTWIN_AVR_CPUFUNC_H
#define KILOTWIN_AVR_CPUFUNC_H

#define _NOP() __asm__ volatile("nop")
#define _MemoryBarrier() __asm__ volatile("" ::: "memory")

#endif
