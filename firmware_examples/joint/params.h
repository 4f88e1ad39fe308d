/* The simulated joint: parameters for its controller, written by lostmotion export 0.1.0.
 * Corrects up to 10.3 arcmin; for one call every 0.5 ms.
 * Every tick needs torque_Nm. */
#ifndef JOINT_PARAMETERS_H
#define JOINT_PARAMETERS_H

/* clang-format off */
#ifndef LOSTMOTION_RUNTIME_H
#include "lostmotion/runtime.h"
#endif

#if LM_PARAMETERS_FORMAT != 3
#error "lostmotion: these parameters were written for another version: export again"
#endif
/* Time between two calls of lm_step_compensator: compare it with that of your loop, */
/* #if JOINT_PARAMETERS_PERIOD_NS != 1000000000 / LOOP_HZ, say. */
#define JOINT_PARAMETERS_PERIOD_NS 500000
#define JOINT_PARAMETERS_PERIOD_S 0.0005f
#if LM_PROFILE == LM_PROFILE_GAP || LM_CURVE_POINTS_MAX < 33 || \
    LM_PLAYS_MAX < 8 || \
    LM_EFFECTS_MAX < 0 || \
    LM_EFFECT_MEMORY_MAX < 0 || \
    LM_ENVELOPE < 0
#error "lostmotion: these parameters need no gap profile and at least LM_CURVE_POINTS_MAX 33, LM_PLAYS_MAX 8, LM_EFFECTS_MAX 0, LM_EFFECT_MEMORY_MAX 0, LM_ENVELOPE 0"
#endif

static const lm_parameters joint_parameters = {
    LM_PARAMETERS_LAYOUT,
    0xbef2c4c5u,
    60.0f, /* torque_limit_Nm */
    /* period_s, correction_rad, velocity_rad_s, acceleration_rad_s2, jerk_rad_s3, response_per_s */
    {0.0005f, 0.003f, 0.05f, 20.0f, 20000.0f, 125.0f},
    /* window_s, fade_s, noise_rad, misfit_rad, creep_rad_s, ringing_Hz */
    {1.0f, 2.0f, 9.696274e-06f, 9.6962736e-05f, 1e-04f, 10.0f},
    /* torque_Nm, temperature_C, cycles, input_velocity_rad_s */
    {0.0f, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}},
    {8, 0, 0, 0.0f, 0.69807047f, 0.0f, 1.0f,
     {
         {0.6f, {1.0f, 1.0f}, 0.11815197f}
         ,{0.92047644f, {1.0f, 1.0f}, 0.31356713f}
         ,{1.4121281f, {1.0f, 1.0f}, 0.098820195f}
         ,{2.1663845f, {1.0f, 1.0f}, 0.08779739f}
         ,{3.3235097f, {1.0f, 1.0f}, 0.033650734f}
         ,{5.0986876f, {1.0f, 1.0f}, 0.027623555f}
         ,{7.8220363f, {1.0f, 1.0f}, 0.013729566f}
         ,{12.0f, {1.0f, 1.0f}, 0.004729944f}
#if LM_PLAYS_MAX > 8
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 9
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 10
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 11
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 12
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 13
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 14
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 15
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 16
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 17
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 18
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 19
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 20
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 21
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 22
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 23
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 24
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 25
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 26
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 27
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 28
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 29
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 30
         ,{0, {1, 1}, 0}
#endif
#if LM_PLAYS_MAX > 31
         ,{0, {1, 1}, 0}
#endif
     }},
    {33,
     {
         -60.0f, -34.0f, -28.0f, -24.0f, -20.0f, -16.0f, -12.0f, -8.0f, -6.0f, -4.0f, -2.4f, -1.2f,
         -0.68f, -0.48f, -0.32f, -0.16f, 0.0f, 0.16f, 0.32f, 0.48f, 0.68f, 1.2f, 2.4f, 4.0f, 6.0f,
         8.0f, 12.0f, 16.0f, 20.0f, 24.0f, 28.0f, 34.0f, 60.0f
#if LM_CURVE_STORE > 33
         ,
         60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f,
         60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f,
         60.0f, 60.0f, 60.0f, 60.0f, 60.0f, 60.0f
#endif
     },
     {
         -0.0021995583f, -0.0015702139f, -0.0014032198f, -0.0012768534f, -0.0011371218f,
         -0.0009763115f, -0.0007947077f, -0.0005807964f, -0.00046055915f, -0.00033618743f,
         -0.00023146151f, -0.00014990102f, -0.00011575218f, -9.70654e-05f, -6.84174e-05f,
         -3.299606e-05f, 0.0f, 3.299606e-05f, 6.84174e-05f, 9.70654e-05f, 0.00011575218f,
         0.00014990102f, 0.00023146151f, 0.00033618743f, 0.00046055915f, 0.0005807964f,
         0.0007947077f, 0.0009763115f, 0.0011371218f, 0.0012768534f, 0.0014032198f, 0.0015702139f,
         0.0021995583f
#if LM_CURVE_STORE > 33
         ,
         0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f,
         0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f,
         0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f,
         0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f,
         0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f, 0.0021995583f,
         0.0021995583f, 0.0021995583f
#endif
     },
     {
         2.4205552e-05f, 2.7832362e-05f, 3.1591597e-05f, 3.493289e-05f, 4.0202576e-05f,
         4.5400957e-05f, 5.3477823e-05f, 6.011862e-05f, 6.218586e-05f, 6.54537e-05f, 6.796707e-05f,
         6.567086e-05f, 9.3433875e-05f, 0.00017905f, 0.00022138338f, 0.00020622538f,
         0.00020622538f, 0.00022138338f, 0.00017905f, 9.3433875e-05f, 6.567086e-05f, 6.796707e-05f,
         6.54537e-05f, 6.218586e-05f, 6.011862e-05f, 5.3477823e-05f, 4.5400957e-05f,
         4.0202576e-05f, 3.493289e-05f, 3.1591597e-05f, 2.7832362e-05f, 2.4205552e-05f,
         2.4205552e-05f
#if LM_CURVE_STORE > 33
         ,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f, 2.4205552e-05f,
         2.4205552e-05f, 2.4205552e-05f
#endif
     }}
#if LM_EFFECTS_MAX > 0
    , 0
    , {
         {0, {0}}
     }
#endif
};

#endif
