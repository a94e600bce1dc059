// Products without rounding, for signs that rounding must not change.
#ifndef EXACT_PRODUCTS_GLSL
#define EXACT_PRODUCTS_GLSL

const float splitter = 4097.0;  // 2^12 + 1: cuts a number into halves whose products are exact

// What rounding took from the product a b [Dekker 1971].
float product_rest(float a, float b, float product) {
    precise float split_a = splitter * a;
    precise float high_a = split_a - (split_a - a);
    precise float low_a = a - high_a;
    precise float split_b = splitter * b;
    precise float high_b = split_b - (split_b - b);
    precise float low_b = b - high_b;
    precise float rest = low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b);
    return rest;
}

// a b - c d, whatever cancels.
float difference_of_products(float a, float b, float c, float d) {
    precise float ab = a * b;
    precise float cd = c * d;
    precise float difference = (ab - cd) + (product_rest(a, b, ab) - product_rest(c, d, cd));
    return difference;
}

#endif
