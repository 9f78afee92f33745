#ifndef TEST_SIZE_H
#define TEST_SIZE_H
#define TEST_WIDTH 16
#define TEST_HEIGHT 8
#endif
