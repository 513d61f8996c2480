// A verb's words and flags, as the verb's own file describes them.  cli/command_line.cpp alone knows the library
// that reads them: CLI11 takes longer to compile than all verbs' flags.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace squint::cli {

/// A word or flag just described: what else is known of it, and whether a user gave it.
class Flag {
  public:
    Flag(const CLI::App& verb, CLI::Option& option) : verb_(&verb), option_(&option) {}
    /// What help writes for its value: "OUT.exr".
    Flag& value(const char* name);
    Flag& required();
    Flag& one_of(const std::vector<std::string_view>& names);
    Flag& between(int least, int greatest);
    Flag& positive();
    Flag& not_negative();
    Flag& separated_by_commas();
    Flag& value_may_be_left_out();
    /// Takes effect where it stands: of a flag and its rivals, the last wins.
    Flag& in_order();
    /// Help shows the default: the variable's value, or `text`.
    Flag& shows_default();
    Flag& shows_default(const char* text);

    // What Flags::then() asks.
    bool given() const;
    bool before(const Flag& other) const;

  private:
    const CLI::App* verb_;
    CLI::Option* option_;
};

/// Describes words ("scene") and flags ("-o,--output") of a verb.  The variables must live until the command
/// line was read.
class Flags {
  public:
    Flags(CLI::App& verb, const std::string& command) : verb_(&verb), command_(&command) {}

    /// A value, read into a variable; of a bool: a flag without a value.  T: bool, int, std::uint64_t, double,
    /// std::optional<double>, std::string, and std::vector of int or std::string.
    template <class T>
    Flag add(const char* names, T& variable, const char* help);
    /// A flag that makes a variable false.
    void clear(const char* names, bool& variable, const char* help);
    /// A name of an enumeration, whose values `allowed` lists in order.
    template <class E>
    void choose(const char* names, std::vector<std::string_view> allowed, E& variable, const char* help) {
        choose_index(
            names, std::move(allowed), [&variable](int index) { variable = static_cast<E>(index); }, help);
    }
    /// A value that `read` takes, and may refuse with an InputError.
    Flag read(const char* names, std::function<void(const std::string&)> read, const char* help);
    Flag read_list(const char* names, std::function<void(const std::vector<std::string>&)> read,
                   const char* help);
    /// Called after everything was read; may refuse what does not go together with an InputError.
    void then(std::function<void()> check);
    /// The whole command as a shell would accept it.
    const std::string& command() const { return *command_; }

  private:
    void choose_index(const char* names, std::vector<std::string_view> allowed,
                      std::function<void(int)> choose, const char* help);

    CLI::App* verb_;
    const std::string* command_;
};

}  // namespace squint::cli
