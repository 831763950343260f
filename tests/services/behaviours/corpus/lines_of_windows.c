#include <kilolib.h>
#define LONG(a) \
  ((a) + \
   1)
void setup() {}
void loop() { // a comment
  set_color(LONG(2) == 3 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
