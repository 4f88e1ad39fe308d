/* A usual sequence of an axis: power-up, close, run, emergency stop, resume, home, brake,
 * power-down, power-up with the history. */
#ifndef AXIS_STORY_H
#define AXIS_STORY_H

/* Returns 0, or the number of the step at which the output jumped or did not reach its target;
 * *most_rad: largest motion of the output after closing the loop. */
int axis_story(float *most_rad);

#endif
