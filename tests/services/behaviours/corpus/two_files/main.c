#include <kilolib.h>
#include "shared.h"
void setup() { common = 20; }
void loop() { set_color(sum(22) == 42 && table[1] == 5 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
