#include <kilolib.h>
#include <stdlib.h>
#include <time.h>
int first, again, soft[3];
void setup() { first = rand(); srand(7); int a = rand(); srand(7); again = a == rand(); for (int i = 0; i < 3; i++) soft[i] = rand_soft(); rand_seed(0xaa); srand(time(NULL)); }
/* avr-libc: 16807 from seed 1, modulo 2^15; kilolib: from 0xaa by shifts. */
void loop() { set_color(first == 16807 && again && soft[0] == (uint8_t)((0xaa ^ (uint8_t)(0xaa << 3)) ^ (uint8_t)(0xaa ^ (uint8_t)(0xaa << 3)) >> 5) && RAND_MAX == 32767 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
