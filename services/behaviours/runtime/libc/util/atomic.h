/* Blocks that callbacks do not interrupt, except where the program has used up a tick's cycles (avr/interrupt.h). */
#ifndef KILOTWIN_UTIL_ATOMIC_H
#define KILOTWIN_UTIL_ATOMIC_H

#define ATOMIC_RESTORESTATE
#define ATOMIC_FORCEON
#define NONATOMIC_RESTORESTATE
#define NONATOMIC_FORCEOFF
#define ATOMIC_BLOCK(kind) for (unsigned char kilotwin_once = 1; kilotwin_once; kilotwin_once = 0)
#define NONATOMIC_BLOCK(kind) ATOMIC_BLOCK(kind)

#endif
