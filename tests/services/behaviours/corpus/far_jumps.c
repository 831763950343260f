#include <kilolib.h>
#include <setjmp.h>
jmp_buf back;
static void deep(int n) { if (n == 0) longjmp(back, 5); deep(n - 1); }
void setup() {}
void loop() { volatile int kept = 3; int came = setjmp(back); if (came == 0) { kept = 4; deep(6); } set_color(came == 5 && kept == 4 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
