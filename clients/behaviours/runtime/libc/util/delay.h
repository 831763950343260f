#ifndef KILOTWIN_UTIL_DELAY_H
#define KILOTWIN_UTIL_DELAY_H

#ifdef __cplusplus
extern "C" {
#endif
void _delay_ms(double ms);
void _delay_us(double us);
#ifdef __cplusplus
}
#endif

#endif
