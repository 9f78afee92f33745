#include "test/size.h"
layout(local_size_x = 1) in;
void main()
{
    int x = undeclared_name;
}
