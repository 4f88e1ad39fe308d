/* Columns of text and numbers on a target's output. */
#ifndef JOINT_TABLE_H
#define JOINT_TABLE_H

/* Text, padded with blanks on the right to `width`. */
void print_left(const char *text, int width);

/* A number with `decimals` digits after the point, padded with blanks on the left to `width`. */
void print_right(float number, int decimals, int width);

#endif
