/* Which release this is, for whoever must tell: `#if LM_VERSION >= 100`.
 *
 * Before 1.0.0 any minor release may change an interface, a patch changes none. The format of
 * stored parameters has a number of its own, LM_PARAMETERS_FORMAT.
 */
#ifndef LOSTMOTION_VERSION_H
#define LOSTMOTION_VERSION_H

#define LM_VERSION_MAJOR 0
#define LM_VERSION_MINOR 1
#define LM_VERSION_PATCH 0

/* Rises with every release: minor and patch have two digits each. */
#define LM_VERSION (LM_VERSION_MAJOR * 10000 + LM_VERSION_MINOR * 100 + LM_VERSION_PATCH)

#endif
