#include "shared.h"
const unsigned char table[] = {4, 5};
int sum(n) int n; { return common + n; }
