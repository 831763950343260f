#include <kilolib.h>
#define MAX(a, b) ({ __typeof__(a) x = (a); __typeof__(b) y = (b); x > y ? x : y; })
static const uint8_t table[8] = {[0 ... 3] = 7, [5] = 0b101};
struct list { uint8_t count; uint8_t items[0]; };
static int jump(int n) { static void *to[] = {&&zero, &&one}; goto *to[n]; zero: return 10; one: return 11; }
void setup() {}
void loop() { int n = 0; switch (kilo_uid) { case 0 ... 9: n = MAX(3, 4); break; default: n = 4; }
  __auto_type z = n ?: 9; set_color(n == 4 && z == 4 && table[2] == 7 && table[5] == 5 && sizeof(struct list) == 1 && jump(1) == 11 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
