/* Compiled with programs that leave it to Kilombo's simulator to make room for their data. */
#include <stdlib.h>

enum { OCTETS = 8192 };

extern int UserdataSize;
extern void* mydata;

static unsigned long long room[OCTETS / 8];

__attribute__((constructor)) static void make_room(void) {
  if (UserdataSize > OCTETS) abort();
  mydata = room;
}
