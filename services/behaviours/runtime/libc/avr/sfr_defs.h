/* Operations on registers. */
#ifndef KILOTWIN_AVR_SFR_DEFS_H
#define KILOTWIN_AVR_SFR_DEFS_H

#define _BV(bit) (1 << (bit))
#define bit_is_set(sfr, bit) ((sfr)&_BV(bit))
#define bit_is_clear(sfr, bit) (!((sfr)&_BV(bit)))
#define loop_until_bit_is_set(sfr, bit) \
  do {                                  \
  } while (bit_is_clear(sfr, bit))
#define loop_until_bit_is_clear(sfr, bit) \
  do {                                    \
  } while (bit_is_set(sfr, bit))

#endif
