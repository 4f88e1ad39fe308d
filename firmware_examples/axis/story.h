/* The axis through a day: power-up, close, run, emergency stop, resume, home, brake, power-down,
 * power-up with the history. */
#ifndef AXIS_STORY_H
#define AXIS_STORY_H

/* 0, or the number of the step at which the output jumped or did not arrive; *most_rad: how far the
 * output moved at most as the loop closed. */
int axis_story(float *most_rad);

#endif
