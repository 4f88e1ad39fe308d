/* Public symbols of the float32 build: each carries the suffix _f32. */
#ifndef LOSTMOTION_NAMES_F32_H
#define LOSTMOTION_NAMES_F32_H

#define lm_status_sentence lm_status_sentence_f32

#endif
