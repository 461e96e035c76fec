// Parses the command line, runs one verb, turns errors into exit codes.
#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <regex>

#include <lamina/apps/run_display.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/config/nearest.hpp>
#include <lamina/version.hpp>

namespace lamina::apps {
namespace {

std::vector<Verb> all_verbs() {
  return {map_verb(),      refine_verb(), scan_verb(), plan_verb(),   simulate_verb(),
          evaluate_verb(), info_verb(),   view_verb(), export_verb(), config_verb()};
}

std::string called_with = "lamina";  // see command_line()

// The verb's example, indented on a line of its own, as a sentence's end.
std::string example_of(const CLI::App& verb) {
  const std::string footer = verb.get_footer();
  const auto begin = footer.find("lamina ");
  return begin == std::string::npos ? "" : "; e.g. " + footer.substr(begin);
}

// The first word that looks like an option and is none, with the one that was meant.
std::optional<std::string> unknown_option(const CLI::App& verb, int argc, const char* const* argv) {
  std::vector<std::string> options;
  for (const auto* option : verb.get_options())
    for (const auto& name : option->get_lnames()) options.push_back("--" + name);
  for (int i = 2; i < argc; ++i) {
    const std::string word = argv[i];
    const std::string name = word.substr(0, word.find('='));
    if (word.rfind("--", 0) != 0 || std::count(options.begin(), options.end(), name)) continue;
    const std::string near = nearest(name, options);
    return "unknown option '" + name + "'" +
           (near.empty() ? ": `lamina " + verb.get_name() + " --help` lists all"
                         : did_you_mean(near));
  }
  return std::nullopt;
}

// A value that is none of a list: CLI11 says "--mode: fast not in {offline,online}".
std::optional<std::string> not_in_list(const std::string& text) {
  static const std::regex kPattern("(-[^:]*): (.*) not in \\{(.*)\\}.*");
  std::smatch parts;
  if (!std::regex_match(text, parts, kPattern)) return std::nullopt;
  return parts[1].str() + " '" + parts[2].str() + "': expected " +
         std::regex_replace(parts[3].str(), std::regex(","), " or ");
}

// One line for what the user typed wrong.
std::string usage_line(const CLI::ParseError& error, const CLI::App& app, int argc,
                       const char* const* argv) {
  if (argc < 2) return "a verb is missing: `lamina --help` lists them";
  std::vector<std::string> verbs;
  const CLI::App* verb = nullptr;
  for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    verbs.push_back(sub->get_name());
    if (sub->get_name() == argv[1]) verb = sub;
  }
  if (!verb) {
    const std::string near = nearest(argv[1], verbs);
    return "unknown verb '" + std::string(argv[1]) + "'" +
           (near.empty() ? ": `lamina --help` lists them" : did_you_mean(near));
  }
  if (const auto unknown = unknown_option(*verb, argc, argv)) return *unknown;
  std::string said = error.what();
  said = said.substr(0, said.find('\n'));
  const std::string name = verb->get_name();
  if (const auto of_list = not_in_list(said)) return name + ": " + *of_list;
  if (const auto end = said.find(" is required"); end != std::string::npos) {
    const std::string option = said.substr(0, end);
    return name + ": " + option + (option == "--output" ? " DIR" : "") + " is missing" +
           example_of(*verb);
  }
  const std::string extra = "The following argument was not expected: ";
  if (said.rfind(extra, 0) == 0)
    return name + ": one INPUT only, found a second: " + said.substr(extra.size());
  return name + ": " + said + example_of(*verb);
}

// `--live 8080` as `--live=8080`: what follows a flag would else be taken for the recording.
std::vector<std::string> joined_live(int argc, const char* const* argv) {
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool number = word.find_first_not_of("0123456789") == std::string::npos;
    const bool place = word.find_first_not_of("0123456789.:[]abcdef") == std::string::npos &&
                       word.find(':') != std::string::npos;
    const bool port = !word.empty() && (number || place);
    if (port && !words.empty() && words.back() == "--live") {
      words.back() += "=" + word;
    } else {
      words.push_back(word);
    }
  }
  std::reverse(words.begin(), words.end());  // as the parser wants them
  return words;
}

// Results that were printed to a full disk or a closed file are lost: an error of writing.
int flushed(int code) {
  std::cout.flush();
  std::fflush(stdout);
  if (std::cout && std::ferror(stdout) == 0) return code;
  throw input_error("standard output", "", "that it cannot be written",
                    "a disk with room, or an open pipe");
}

}  // namespace

const std::string& command_line() { return called_with; }

int run(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) called_with += " " + std::string(argv[i]);
  // Sparse solvers below sum in the order of their threads: one keeps the bytes the same anywhere.
  omp_set_num_threads(1);
  // A file larger than the system allows is an error of writing, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
  set_up_log(false);  // lines for people go to stderr, whatever the verb
  CLI::App app{"Planes, floors and trajectories from depth cameras, stereo and 2D lidars",
               "lamina"};
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("lamina ") + kVersion);
  app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
  std::vector<std::pair<CLI::App*, std::function<int()>>> actions;
  for (const Verb& verb : all_verbs()) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.summary);
    sub->footer("Example:\n  " + verb.example);
    actions.emplace_back(sub, verb.add(*sub));
  }
  try {
    app.parse(joined_live(argc, argv));
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForAllHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForVersion& version) {
    return app.exit(version);
  } catch (const CLI::ParseError& error) {
    std::cerr << "lamina: " << usage_line(error, app, argc, argv) << '\n';
    return kUsage;
  }
  try {
    for (const auto& [sub, action] : actions) {
      if (sub->parsed()) return flushed(action());
    }
    return kUsage;
  } catch (const Error& error) {
    std::cerr << "lamina: " << error.what() << '\n';
    return kUsage;
  } catch (const std::filesystem::filesystem_error& error) {
    std::cerr << "lamina: " << error.path1().string() << ": found that " << error.code().message()
              << ", expected a file or folder that can be read and written\n";
    return kUsage;
  } catch (const std::exception& error) {
    std::cerr << "lamina: failed: " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace lamina::apps
