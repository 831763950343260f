/* What a cell of a simulated Kilogrid finds in its EEPROM, in C and C++: the experiment's checks write it, the modules' runtime
 * reads it. Four octets, then the module's configuration:
 *
 *   0x100, 0x101  column and row of the cell's module, from the bottom left
 *   0x102         the cell's number in its module: 0 top left, 1 top right, 2 bottom left, 3 bottom right
 *   0x103         octets of the configuration, 0..48; 0xFF: the robot is no cell */
#ifndef KILOTWIN_CORE_BASE_KILOGRID_CELL_H
#define KILOTWIN_CORE_BASE_KILOGRID_CELL_H

enum {
  KILOTWIN_CELL_MODULE_X = 0x100,
  KILOTWIN_CELL_MODULE_Y = 0x101,
  KILOTWIN_CELL_NUMBER = 0x102,
  KILOTWIN_CELL_OCTETS = 0x103,
  KILOTWIN_CELL_CONFIGURATION = 0x104,
  KILOTWIN_CELL_MOST_OCTETS = 48
};

#endif
