/* Messages between the robots grid_vote.c and the cells grid_module.c. */
#ifndef GRID_MESSAGES_H
#define GRID_MESSAGES_H

enum { CELL_MESSAGE = 0x20, OPINION_MESSAGE = 0x22 };
enum { CELL_COLOUR, CELL_AT_RIM };      /* octets of a CELL_MESSAGE */
enum { OPINION_COLOUR, OPINION_ROBOT }; /* octets of an OPINION_MESSAGE */

#endif
