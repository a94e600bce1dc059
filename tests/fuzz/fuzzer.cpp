// libFuzzer's entry: one program a target, named by TANDEM_FUZZ_TARGET.
#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
    tandem::fuzz::TANDEM_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
    return 0;
}
