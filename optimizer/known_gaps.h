/* The smallest gaps of the geometries that were verified. Designs that differ in their tolerances
 * alone have the same ones, and a front has several of each geometry.
 */
#ifndef LOSTMOTION_OPTIMIZER_KNOWN_GAPS_H
#define LOSTMOTION_OPTIMIZER_KNOWN_GAPS_H

#include "lostmotion/checks.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lm_known_gaps lm_known_gaps;

/* Null: out of memory. */
lm_known_gaps *lm_create_known_gaps(void);
void lm_free_known_gaps(lm_known_gaps *known); /* may be null */

/* lm_find_face_gap on the grid of the certificate, without an evaluation if the geometry is known;
 * the bytes of the drive must have been zero before it was filled. `known` may be null, and threads
 * may share it. */
lm_status lm_find_known_gap(lm_known_gaps *known, const lm_drive *drive, lm_mesh meshes[],
                            lm_smallest_gap *smallest);

#ifdef __cplusplus
}
#endif

#endif
