#include <kilolib.h>
double four = 4;
void setup() {}
void loop() { set_color(sqrt(four) == 2 && pow(four, 0.5) == 2 && fabs(-four) == 4 && floor(four / 3) == 1 && abs(-3) == 3 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
