#include <kilolib.h>
/* The names of the C library that students take. */
int index, time, y1 = 2, j0, read, write, signal, link, select, gamma1, remove_me;
float round(float x) { return (float)(int)(x + 0.5f) + 100; }
int abs(int v) { return v < 0 ? -v : v; }
uint8_t random(void) { return 42; }
void swap(uint8_t *a, uint8_t *b) { uint8_t c = *a; *a = *b; *b = c; }
int log2(int n) { int r = 0; while (n >>= 1) r++; return r; }
void sleep(void) { index++; }
int min(int a, int b) { return a < b ? a : b; }
char *itoa(int n) { static char c[2]; c[0] = '0' + n; return c; }
void setup() {}
void loop() { uint8_t a = 1, b = 2; swap(&a, &b); sleep(); time = min(3, 2); set_color(a == 2 && abs(-5) == 5 && random() == 42 && log2(1024) == 10 && (int)round(2.6f) == 103 && time == 2 && index > 0 && itoa(7)[0] == '7' ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
