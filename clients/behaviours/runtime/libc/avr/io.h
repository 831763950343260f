/* The port registers of an ATmega328P as plain memory: programs that touch pins compile; nothing is connected to them. */
#ifndef KILOTWIN_AVR_IO_H
#define KILOTWIN_AVR_IO_H

#include <stdint.h>

extern volatile uint8_t PORTB, PORTC, PORTD, DDRB, DDRC, DDRD, PINB, PINC, PIND;

#define _BV(bit) (1 << (bit))
#define bit_is_set(sfr, bit) ((sfr) & _BV(bit))
#define bit_is_clear(sfr, bit) (!((sfr) & _BV(bit)))

#endif
