#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <kilolib.h>
#include <util/atomic.h>
#include <util/delay.h>
const uint16_t primes[] PROGMEM = {2, 3, 5, 257};
const char word[] PROGMEM = "hop";
volatile uint8_t overflows;
ISR(TIMER2_OVF_vect) { overflows++; }
SIGNAL(WDT_vect) { overflows++; }
void setup() { TCCR1B |= (1 << CS10); TIMSK1 = _BV(TOIE1); DDRB |= _BV(PB5); wdt_enable(WDTO_2S); }
void loop() { uint8_t n = 0; ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { n = 3; } wdt_reset(); asm volatile("nop"); cli(); PORTB ^= _BV(5); sei();
  set_color(n == 3 && pgm_read_word(&primes[3]) == 257 && strcmp_P("hop", word) == 0 && overflows == 0 && bit_is_set(DDRB, PB5) ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
