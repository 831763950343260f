/* The LEDs of a Kilogrid's cells. */
#ifndef KILOTWIN_KILOGRID_MODULE_LED_H
#define KILOTWIN_KILOGRID_MODULE_LED_H

#include <module.h>

typedef enum { LED_OFF = 0, RED = 1, GREEN = 2, YELLOW = 3, BLUE = 4, MAGENTA = 5, CYAN = 6, WHITE = 7 } color_t;

/* Shown with 2 bits per colour. */
typedef enum { LOW = 0x05, ADJUSTED = 0x20, MEDIUM = 0x7A, HIGH = 0xF0 } brightness_t;

#ifdef __cplusplus
extern "C" {
#endif
void set_LED(cell_num_t cell, color_t color);
void set_all_LEDs(color_t color);
/* Red, green, blue, 0..255 each. */
void set_all_LEDs_hex(uint8_t color[]);
void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness);
void set_all_LEDs_with_brightness(color_t color, brightness_t brightness);
#ifdef __cplusplus
}
#endif
#endif
