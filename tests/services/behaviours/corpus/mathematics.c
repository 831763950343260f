#include <kilolib.h>
#include <math.h>
#define NEAR(a, b) (fabs((a) - (b)) < 1e-9)
double x = 0.3, whole; int two;
const float third = 1.0 / 3, size = M_PI * 33 / 2;
void setup() {}
void loop() { set_color(NEAR(sin(x) * sin(x) + cos(x) * cos(x), 1) && NEAR(cbrt(27.0 * x * x * x), 3 * x) && lround(-2.5) == -3 && NEAR(modf(3.25, &whole), 0.25) && whole == 3 && NEAR(ldexp(frexp(10, &two), two), 10) && NEAR(exp(log(x)), x) && NEAR(atan2(1, 1), M_PI_4) && NEAR(hypot(3, 4), 5) && NEAR(log1p(expm1(x)), x) && fmod(7, 4) == 3 && round(2.5) == 3 && rint(2.5) == 2 && square(3) == 9 && isnan(sqrt(-1)) && roundf(third * 3) == 1 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
