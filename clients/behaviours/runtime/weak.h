/* Programs may have functions of their own under the names of the C library, as on the robot: the library's give way. */
#define KT_TEXT(text) #text
#define WEAK(name) _Pragma(KT_TEXT(weak name))

// clang-format off
WEAK(abs) WEAK(labs) WEAK(llabs) WEAK(atoi) WEAK(atol) WEAK(rand) WEAK(srand) WEAK(rand_r) WEAK(random)
WEAK(srandom) WEAK(qsort) WEAK(bsearch) WEAK(malloc) WEAK(calloc) WEAK(realloc) WEAK(free) WEAK(exit)
WEAK(abort) WEAK(memcpy) WEAK(memmove) WEAK(memset) WEAK(memcmp) WEAK(memchr) WEAK(strlen) WEAK(strnlen)
WEAK(strcmp) WEAK(strncmp) WEAK(strcpy) WEAK(strncpy) WEAK(strcat) WEAK(strchr) WEAK(strrchr) WEAK(strstr)
WEAK(vsnprintf) WEAK(snprintf) WEAK(sprintf) WEAK(printf) WEAK(puts) WEAK(putchar) WEAK(lround) WEAK(lrint)
WEAK(sin) WEAK(sinf) WEAK(cos) WEAK(cosf) WEAK(tan) WEAK(tanf) WEAK(asin) WEAK(asinf) WEAK(acos) WEAK(acosf)
WEAK(atan) WEAK(atanf) WEAK(exp) WEAK(expf) WEAK(log) WEAK(logf) WEAK(log2) WEAK(log2f) WEAK(log10) WEAK(log10f)
WEAK(sqrt) WEAK(sqrtf) WEAK(fabs) WEAK(fabsf) WEAK(floor) WEAK(floorf) WEAK(ceil) WEAK(ceilf) WEAK(round)
WEAK(roundf) WEAK(trunc) WEAK(truncf) WEAK(square) WEAK(squaref) WEAK(sinh) WEAK(sinhf) WEAK(cosh) WEAK(coshf)
WEAK(tanh) WEAK(tanhf) WEAK(atan2) WEAK(atan2f) WEAK(pow) WEAK(powf) WEAK(fmod) WEAK(fmodf) WEAK(hypot)
WEAK(hypotf) WEAK(fmin) WEAK(fminf) WEAK(fmax) WEAK(fmaxf) WEAK(copysign) WEAK(copysignf) WEAK(eeprom_read_byte)
WEAK(eeprom_read_word) WEAK(eeprom_read_dword) WEAK(eeprom_read_float) WEAK(eeprom_read_block)
WEAK(eeprom_write_byte) WEAK(eeprom_write_word) WEAK(eeprom_write_dword) WEAK(eeprom_write_float)
WEAK(eeprom_write_block)
// clang-format on
