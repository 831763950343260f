/* The port registers of an ATmega328P as plain memory: programs that touch pins compile; nothing is connected to them. */
#ifndef KILOTWIN_AVR_IO_H
#define KILOTWIN_AVR_IO_H

#include <stdint.h>

extern volatile uint8_t PORTB, PORTC, PORTD, DDRB, DDRC, DDRD, PINB, PINC, PIND;
/* The serial line, always ready for the next octet. */
extern volatile uint8_t UCSR0A, UCSR0B, UCSR0C, UBRR0H, UBRR0L, UDR0;
enum { U2X0 = 1, UDRE0 = 5, TXC0 = 6, RXC0 = 7, TXEN0 = 3, RXEN0 = 4, UCSZ00 = 1, UCSZ01 = 2 };

#define _BV(bit) (1 << (bit))
#define bit_is_set(sfr, bit) ((sfr)&_BV(bit))
#define bit_is_clear(sfr, bit) (!((sfr)&_BV(bit)))

#endif
