// Man pages and completions: made of the tables that make --help.
#include "program.h"

#include <gmock/gmock.h>

#include <regex>

namespace squint::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Manual : public Program {
  protected:
    static bool there_is(const std::string& program) {
        return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
    }
    std::string completed(const std::string& words, int at) const {
        return shell(
                   "\"$SQUINT\" help --form bash > c && bash --norc -c 'compopt() { :; }; source ./c; "
                   "COMP_WORDS=(" +
                   words + "); COMP_CWORD=" + std::to_string(at) + "; _squint; echo \"${COMPREPLY[*]}\"'")
            .out;
    }
};

std::vector<std::string> verbs_of(const std::string& help) {
    std::vector<std::string> verbs;
    const std::regex line("\\n  ([a-z]+)  +[A-Z]");
    for (std::sregex_iterator at(help.begin(), help.end(), line), end; at != end; ++at)
        verbs.push_back((*at)[1]);
    return verbs;
}

TEST_F(Manual, EveryVerbHasAManPageWithEveryFlag) {
    const std::string all = squint("help --form man").out;
    const std::vector<std::string> verbs = verbs_of(squint("help").out);
    ASSERT_GE(verbs.size(), 14u);
    for (const std::string& verb : verbs) {
        EXPECT_THAT(all, HasSubstr("squint\\-" + verb + "\\fR(1)"));
        const std::string page = squint("help --form man " + verb).out, help = squint("help " + verb).out;
        EXPECT_TRUE(page.starts_with(".TH SQUINT")) << verb;
        const std::regex flag("\\n  [-a-zA-Z,]*(--[a-z-]+)");
        int flags = 0;
        for (std::sregex_iterator at(help.begin(), help.end(), flag), end; at != end; ++at, ++flags)
            EXPECT_THAT(page, HasSubstr(std::regex_replace((*at)[1].str(), std::regex("-"), "\\-"))) << verb;
        EXPECT_GE(flags, 1) << verb;
    }
}

TEST_F(Manual, AFlagSaysWhatItTakesAndWhatMayBeLeftOut) {
    const std::string compare = squint("help compare --form man").out;
    EXPECT_THAT(compare, HasSubstr("\\fBsquint compare\\fR [\\fIFLAGS\\fR] \\fIA\\fR \\fIB\\fR\n"));
    EXPECT_THAT(compare, HasSubstr("\\fB\\-\\-json\\fR [\\fIFILE|\\-\\fR]\n")) << "its value may be left out";
    EXPECT_THAT(compare, HasSubstr("\\fB\\-\\-max\\-error\\fR, \\fB\\-\\-fail\\-above\\fR \\fILSB8\\fR\n"));
    const std::string plan = squint("help plan --form man").out;
    EXPECT_THAT(plan, HasSubstr("\\fB\\-\\-brief\\fR\n")) << "takes no value";
    const std::string zsh = squint("help --form zsh").out;
    EXPECT_THAT(zsh, HasSubstr(":NAME:(auto model lanes)'"));
    EXPECT_THAT(zsh, HasSubstr("::FILE|-:_files'"));
}

TEST_F(Manual, TheScenesPageHasEveryKeyAndItsWords) {
    const std::string page = squint("help --form scene").out;
    for (const char* part : {".TH SQUINT\\-SCENE 5", "\\fBsampling.step\\fR",
                             "\\fBprecision.transparency\\fR", "phong, blinn_phong, cone, gooch"})
        EXPECT_THAT(page, HasSubstr(part));
}

TEST_F(Manual, PagesAreGoodRoff) {
    if (!there_is("groff")) GTEST_SKIP() << "groff is not installed";
    for (const char* page : {"--form man", "--form man render", "--form man number", "--form scene"}) {
        const Outcome r = shell("\"$SQUINT\" help " + std::string(page) + " | groff -man -ww -z -Tascii");
        EXPECT_EQ(r.code, 0) << page;
        EXPECT_EQ(r.err, "") << page;
    }
}

TEST_F(Manual, BashCompletesVerbsFlagsKeysAndTheirWords) {
    EXPECT_EQ(completed("squint ren", 1), "render\n");
    EXPECT_EQ(completed("squint render --prev", 2), "--preview\n");
    EXPECT_EQ(completed("squint render --path mo", 3), "model\n");
    EXPECT_EQ(completed("squint render --set sampling.st", 3), "sampling.step=\n");
    EXPECT_EQ(completed("squint render --set precision.transp", 3), "precision.transparency=\n");
    EXPECT_EQ(completed("squint render --set precision.preset = sq", 5), "squeeze\n");
    EXPECT_EQ(completed("squint render @lee_shin/figure_5", 2), "@lee_shin/figure_5\n");
    EXPECT_EQ(completed("squint help sw", 2), "sweep\n");
}

TEST_F(Manual, OtherShellsTakeTheirCompletions) {
    for (const char* name : {"bash", "zsh", "fish"}) {
        const std::string text = squint("help --form " + std::string(name)).out;
        for (const char* part : {"render", "max-error", "precision.preset", "@lee_shin/figure_5"})
            EXPECT_THAT(text, HasSubstr(part)) << name;
        if (!there_is(name)) continue;
        const Outcome r = shell("\"$SQUINT\" help --form " + std::string(name) + " > c && " + name + " -n c");
        EXPECT_EQ(r.code, 0) << name << r.err;
        EXPECT_EQ(r.err, "") << name;
    }
}

TEST_F(Manual, ScenesThatComeWithSquintAreFoundByTheirName) {
    EXPECT_THAT(squint("help --list").out, HasSubstr("@lee_shin/figure_5\n"));
    const Outcome r = squint("render @lee_shin/figure_5 --size 16x16 -q");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_TRUE(has("figure_5.exr"));
    expect_refusal(squint("render @lee_shin/figure_55"), "did you mean \"@lee_shin/figure_5\"?");
}

}  // namespace
}  // namespace squint::test
