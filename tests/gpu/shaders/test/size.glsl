#include "test/size.h"
