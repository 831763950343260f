#include <kilolib.h>
void setup() {}
void loop() { set_color(1 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
void main() { kilo_init(); kilo_start(setup, loop); }
