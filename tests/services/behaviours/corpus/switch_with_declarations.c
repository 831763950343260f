#include <kilolib.h>
void setup() {}
void loop() { int n = 0; switch (kilo_uid & 1) { int hidden; case 0: hidden = 4; n = hidden; break; case 1: { int own = 4; n = own; } }
  set_color(n == 4 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
