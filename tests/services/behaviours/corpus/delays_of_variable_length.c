#include <kilolib.h>
#include <util/delay.h>
uint8_t rounds;
void setup() { for (int ms = 1; ms < 40; ms += 5) _delay_ms(ms); }
void loop() { int us = 100; for (uint8_t i = 0; i < 3; i++) { _delay_us(us * i); delay(i); } rounds++; set_color(rounds > 0 && kilo_ticks > 0 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
