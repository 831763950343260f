#ifndef KILOTWIN_UTIL_PARITY_H
#define KILOTWIN_UTIL_PARITY_H

#define parity_even_bit(value) __builtin_parity((unsigned char)(value))

#endif
