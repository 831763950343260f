#include <kilolib.h>
void setup() {}
void loop() { int sum = 0; void add(int n) { sum += n; } add(3); add(4); set_color(sum == 7 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
