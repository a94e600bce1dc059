#include <doctest/doctest.h>

#include "common/exercise/submission.h"

using namespace tandem;

TEST_CASE("a submission is compiled without its comments, line by line where it was") {
    CHECK(without_comments("float x; // #include\n/* gl_Position\n*/ float y;") ==
          "float x;            \n              \n   float y;");
    CHECK(without_comments("a / b /*/ c */ d") == "a / b          d");
}

TEST_CASE("a submission names nothing beyond its function") {
    for (const char* text : {"#define x", "  # include <a>", "/* */#x", "layout(set = 0) buffer", "uniform float x;",
             "void main() {}", "float f() { return gl_NumWorkGroups.x; }", "float tandem_x;", "float a__b;",
             "in vec3 x;", "float a \\\n;", "float \xc3\xa9;", "/* no end", "shared float x;"})
        CHECK_THROWS_AS((void)without_comments(text), RefusedSubmission);
    CHECK_NOTHROW((void)without_comments("float f(in vec3 x, out float inner) { return x.x; }"));
    CHECK_THROWS_WITH((void)without_comments("float x;\n\n#y"),
        "line 3: directives (#include, #extension, #define) are not allowed; leave it out");
}

TEST_CASE("arguments are named number by number") {
    CHECK(names_of_values("origin:3 radius film:2") ==
          std::vector<std::string>{"origin.x", "origin.y", "origin.z", "radius", "film.x", "film.y"});
}
