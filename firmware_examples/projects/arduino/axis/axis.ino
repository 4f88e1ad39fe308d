// A usual sequence of an axis, reported over the serial port.
//
// Install the library: python lib/amalgamate.py --arduino ~/Arduino/libraries/lostmotion
// Arduino compiles only the files in the folder of a sketch, so copy into it:
//   firmware_examples/axis             as src/axis
//   firmware_examples/joint/params.h   as src/joint/params.h, or the parameters of your joint
//
// A board of 8 bits computes in software: an ATmega2560 takes several ms a tick. A position loop
// wants a Cortex-M4F, an ESP32 or an RP2350.
#include <lostmotion.h>

extern "C" {
#include "src/axis/story.h"
}

void setup() {
  Serial.begin(115200);
  float most_rad;
  const int failed = axis_story(&most_rad);
  if (failed) {
    Serial.print(F("the axis failed at step "));
    Serial.println(failed);
  } else {
    Serial.print(F("the axis ran; closing moved it by "));
    Serial.print(most_rad * 206264.8f);
    Serial.println(F(" arcsec at most"));
  }
  Serial.flush();
}

void loop() {
  // In a drive: lm_axis_tick() once in every period of the parameters, from a timer.
}
