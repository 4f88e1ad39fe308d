/* Version of the library, for checks such as `#if LM_VERSION >= 100`.
 *
 * Before 1.0.0 a minor release may change an interface, a patch release does not. The format of
 * stored parameters has its own number, LM_PARAMETERS_FORMAT.
 */
#ifndef LOSTMOTION_VERSION_H
#define LOSTMOTION_VERSION_H

#define LM_VERSION_MAJOR 0
#define LM_VERSION_MINOR 1
#define LM_VERSION_PATCH 0

/* Increases with every release: minor and patch have two digits each. */
#define LM_VERSION (LM_VERSION_MAJOR * 10000 + LM_VERSION_MINOR * 100 + LM_VERSION_PATCH)

#endif
