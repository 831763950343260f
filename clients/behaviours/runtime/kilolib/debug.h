/* printf over the serial line of a robot under development. Simulated robots have no serial line: with and without DEBUG
 * the text is dropped, but with DEBUG the arguments are evaluated and checked. */
#ifndef KILOTWIN_DEBUG_H
#define KILOTWIN_DEBUG_H

#ifdef DEBUG
#include <stdio.h>
#define debug_init() ((void)0)
#else
#define debug_init()
#define printf(...)
#endif

#endif
