/* Random numbers of a Kilogrid's modules: kilolib's, with another name for the seed. */
#ifndef KILOTWIN_KILOGRID_RAND_H
#define KILOTWIN_KILOGRID_RAND_H

#include <kilolib.h>

#define rand_set_seed rand_seed

#endif
