#include <kilolib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static int by_value(const void *a, const void *b) { return *(const int *)a - *(const int *)b; }
static char line[80];
static int fails() {
  char list[] = "hop,12;0x1f", *place, number[12]; int a = 0, key = 4, values[] = {9, 4, 7}; float f = 0; unsigned u = 0; char word[8] = "";
  if (strcmp(strtok(list, ",;"), "hop") || atoi(strtok(NULL, ",;")) != 12 || strtol(strtok(NULL, ",;"), &place, 0) != 31 || *place) return 1;
  if (sscanf("id=17 -2.5 x ff", "id=%d %f %s %x", &a, &f, word, &u) != 4 || a != 17 || f != -2.5f || strcmp(word, "x") || u != 255) return 2;
  if (strcmp(itoa(-42, number, 10), "-42") || strcmp(utoa(255, number, 2), "11111111") || strcmp(dtostrf(3.14159, 7, 2, number), "   3.14")) return 3;
  qsort(values, 3, sizeof *values, by_value);
  if (values[0] != 4 || values[2] != 9 || bsearch(&key, values, 3, sizeof *values, by_value) != values) return 4;
  sprintf(line, "%05d|%-4u|%x|%X|%c|%s|%.2f|%g|%e|%%|%ld", -42, 7u, 255, 255, 'k', "bot", 2.345, 0.5, 12345.678, 70000L);
  if (strcmp(line, "-0042|7   |ff|FF|k|bot|2.35|0.5|1.234568e+04|%|70000")) return 5;
  if (strtod("-1.5e2z", &place) != -150 || *place != 'z' || strtoul("777", NULL, 8) != 511) return 6;
  if (strcmp(strncat(strcpy(line, "ab"), "cdef", 2), "abcd") || strcasecmp("KiLo", "kIlO") || strspn("112x", "12") != 3 || strcmp(strrchr("a/b/c", '/'), "/c")) return 7;
  return 0;
}
void setup() {}
void loop() { set_color(fails() == 0 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
