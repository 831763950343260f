#include <kilolib.h>
int value;
void setup();
void loop();
int set(n) { value = n; }
void setup() { set(7); later(); }
void loop() { set_color(value == 8 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
later() { value++; }
main() { kilo_init(); kilo_start(setup, loop); }
