/* Callbacks happen only while a program waits or between calls of loop(), so there is nothing to disable. */
#ifndef KILOTWIN_AVR_INTERRUPT_H
#define KILOTWIN_AVR_INTERRUPT_H
#define sei() ((void)0)
#define cli() ((void)0)
#endif
