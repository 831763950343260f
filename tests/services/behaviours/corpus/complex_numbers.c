#include <complex.h>
#include <kilolib.h>
#include <math.h>
double complex z = 3 + 4 * I;
void setup() {}
void loop() { double complex w = z * z / z; set_color(cabs(z) == 5 && fabs(creal(cexp(I * M_PI)) + 1) < 1e-9 && fabs(cimag(w) - 4) < 1e-9 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
