// Runs a fuzz target where there is no libFuzzer: mutated seeds, the same ones for a seed's number wherever it runs.
//
//     fuzz_NAME [-runs=N] [-seed=N] [-max_len=N] [-random_bytes=N] [other flags of libFuzzer, not heard] FOLDER...
//
// -random_bytes: after the seeds, so many random bytes instead of a mutated seed, for targets that draw from them.
// It looks at no coverage: tools/fuzz, with libFuzzer, finds more.  What ends the program is written to crash-NAME.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::string;

Bytes input;             // at hand: what a signal's handler writes
std::string crash_file;  // where to

void write_input(int signal) {
    const int file = open(crash_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    [[maybe_unused]] const auto written = write(file, input.data(), input.size());
    constexpr char message[] = "the input is in ";
    [[maybe_unused]] auto said = write(2, message, sizeof message - 1);
    said = write(2, crash_file.data(), crash_file.size()), said = write(2, "\n", 1);
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

class Mutator {
  public:
    Mutator(std::vector<Bytes> seeds, unsigned seed, std::size_t longest)
        : seeds_(std::move(seeds)), random_(seed), longest_(longest) {}

    Bytes random_bytes(std::size_t count) {
        Bytes bytes(count, '\0');
        for (char& byte : bytes) byte = static_cast<char>(below(256));
        return bytes;
    }
    Bytes next() {
        Bytes bytes = any_seed();
        for (std::size_t changes = 1 + below(5); changes > 0; --changes) change(bytes);
        if (bytes.size() > longest_) bytes.resize(longest_);
        return bytes;
    }

  private:
    std::size_t below(std::size_t n) { return random_() % n; }  // n > 0
    const Bytes& any_seed() { return seeds_[below(seeds_.size())]; }
    std::size_t place(const Bytes& bytes) { return below(bytes.size() + 1); }
    std::size_t part(const Bytes& bytes, std::size_t from) {
        return below(std::min<std::size_t>(bytes.size() - from, below(4) == 0 ? bytes.size() : 8) + 1);
    }

    void change(Bytes& bytes) {
        static constexpr const char* kWords[] = {"0",
                                                 "-1",
                                                 "1e308",
                                                 "-1e-308",
                                                 "nan",
                                                 "inf",
                                                 "65535",
                                                 "2147483648",
                                                 "9223372036854775808",
                                                 "\"",
                                                 "'",
                                                 "[",
                                                 "]",
                                                 "{",
                                                 "}",
                                                 "=",
                                                 ",",
                                                 "\n",
                                                 "\r\n",
                                                 "\t",
                                                 "#",
                                                 "//",
                                                 "\xc3\xbc",
                                                 "\xff",
                                                 "\xed\xa0\x80",
                                                 ".",
                                                 "\\"};
        const std::size_t at = place(bytes), end = at + part(bytes, at);
        switch (below(8)) {
            case 0:  // one bit
                if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
                return;
            case 1:  // one byte
                if (at < bytes.size()) bytes[at] = static_cast<char>(below(256));
                return;
            case 2:  // what a length or a sign may be
                if (at < bytes.size()) bytes[at] = "\x00\x01\x7f\x80\xff\x40"[below(6)];
                return;
            case 3:
                bytes.erase(at, end - at);
                return;
            case 4:
                bytes.insert(place(bytes), bytes.substr(at, end - at));
                return;
            case 5: {  // a part of another
                const Bytes& other = any_seed();
                const std::size_t from = place(other);
                bytes.replace(at, end - at, other.substr(from, part(other, from)));
                return;
            }
            case 6:
                bytes.replace(at, end - at, kWords[below(std::size(kWords))]);
                return;
            default: {  // a number in a text
                const std::size_t digit = bytes.find_first_of("0123456789", at);
                if (digit != Bytes::npos)
                    bytes.replace(digit, bytes.find_first_not_of("0123456789", digit) - digit,
                                  kWords[below(9)]);
            }
        }
    }

    std::vector<Bytes> seeds_;
    std::mt19937 random_;
    std::size_t longest_;
};

}  // namespace

int main(int argc, char** argv) {
    namespace fs = std::filesystem;
    long runs = 10000;
    unsigned seed = 1;
    std::size_t longest = 8192, random_bytes = 0;
    std::vector<Bytes> seeds{""};
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const auto number = [&] {
            return std::strtol(argument.c_str() + argument.find('=') + 1, nullptr, 10);
        };
        if (argument.starts_with("-runs=")) runs = number();
        if (argument.starts_with("-seed=")) seed = static_cast<unsigned>(number());
        if (argument.starts_with("-max_len=")) longest = static_cast<std::size_t>(number());
        if (argument.starts_with("-random_bytes=")) random_bytes = static_cast<std::size_t>(number());
        if (argument.starts_with('-')) continue;
        std::vector<fs::path> files{argument};
        if (fs::is_directory(argument))
            files.assign(fs::directory_iterator(argument), fs::directory_iterator());
        std::sort(files.begin(), files.end());
        for (const fs::path& file : files) {
            std::ifstream bytes(file, std::ios::binary);
            seeds.emplace_back(std::istreambuf_iterator<char>(bytes), std::istreambuf_iterator<char>());
        }
    }
    crash_file = "crash-" + fs::path(argv[0]).filename().string();
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS, SIGALRM})
        std::signal(signal, write_input);
    Mutator mutator(seeds, seed, longest);
    for (long run = 0; run < runs; ++run) {
        input = run < static_cast<long>(seeds.size()) ? seeds[static_cast<std::size_t>(run)]
                : random_bytes > 0                    ? mutator.random_bytes(random_bytes)
                                                      : mutator.next();
        alarm(20);  // what takes longer is a fault, too
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    }
    std::printf("%ld inputs from %zu seeds\n", runs, seeds.size());
    return 0;
}
