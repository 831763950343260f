#include <kilolib.h>
#include <stdlib.h>
#include <string.h>
static int sum(int n, const uint8_t values[n]) { int s = 0; for (int i = 0; i < n; i++) s += values[i]; return s; }
void setup() {}
void loop() { int n = 5 + kilo_uid % 2; uint8_t values[n]; memset(values, 2, n); uint8_t *more = alloca(n); memcpy(more, values, n);
  set_color(sum(n, values) == 2 * n && sum(n, more) == 2 * n && sizeof values == n ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
