#include <kilolib.h>
typedef struct { uint8_t id : 4, kind : 3, last : 1; uint16_t value; uint32_t when; } record;
typedef union { record r; uint8_t octets[7]; } shared;
enum small { A, B, C };
struct mixed { uint8_t a; uint32_t b; enum small c; };
struct { int n : 3; } sign = {7};
void setup() {}
void loop() { shared s = {{5, 6, 1, 0x1234, 0xdeadbeef}};
  set_color(sizeof(record) == 7 && sizeof(struct mixed) == 6 && sizeof(enum small) == 1 && s.octets[0] == (5 | 6 << 4 | 1 << 7) && s.octets[1] == 0x34 && s.octets[6] == 0xde && sign.n == 7 && (char)200 == 200 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
