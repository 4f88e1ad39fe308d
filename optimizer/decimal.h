/* Numbers in files: a decimal point in every locale that the host program may have set. */
#ifndef LOSTMOTION_OPTIMIZER_DECIMAL_H
#define LOSTMOTION_OPTIMIZER_DECIMAL_H

#ifdef __cplusplus
extern "C" {
#endif

/* Longest text: sign, 17 digits, decimal point and exponent, with room for the decimal point of any
 * locale. */
#define LM_DECIMAL_MAX 48

/* Digits that preserve every bit of a double. */
#define LM_DECIMAL_EXACT 17

/* Write a value with a number of significant digits, like printf's %g in the locale "C", and return
 * the text. digits <= LM_DECIMAL_EXACT. */
const char *lm_write_decimal(char text[LM_DECIMAL_MAX], double value, int digits);

/* Read a word that is completely a number, like strtod in the locale "C". 1: it is a number. */
int lm_read_decimal(const char *word, double *value);

#ifdef __cplusplus
}
#endif

#endif
