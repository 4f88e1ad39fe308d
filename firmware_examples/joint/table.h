/* Columns of text and numbers on a target's output. */
#ifndef JOINT_TABLE_H
#define JOINT_TABLE_H

/* Text, then blanks up to `width`. */
void print_left(const char *text, int width);

/* A number with `decimals` digits behind the point, blanks before it up to `width`. */
void print_right(float number, int decimals, int width);

#endif
