#include <kilolib.h>
/* Größe */ static const char name[] = "été"; // müde
void setup() {}
void loop() { set_color(sizeof name == 4 && (uint8_t)name[0] == 0xe9 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
