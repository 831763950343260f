#include <kilolib.h>
inline int twice(int n) { return 2 * n; }
extern inline int thrice(int n) { return 3 * n; }
static inline int once(int n) { return n; }
int (*which)(int) = twice;
void setup() {}
void loop() { set_color(which(4) == 8 && twice(5) == 10 && thrice(2) == 6 && once(1) == 1 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
