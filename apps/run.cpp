// Parses the command line, runs one verb, turns errors into exit codes.
#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>

#include <lamina/apps/nearest.hpp>
#include <lamina/apps/verbs.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {
namespace {

std::vector<Verb> all_verbs() {
  return {map_verb(),      refine_verb(), scan_verb(), plan_verb(),  simulate_verb(),
          evaluate_verb(), info_verb(),   view_verb(), config_verb()};
}

// One line for what the user typed wrong: the verb or option that was meant, where one is near.
std::string usage_line(const CLI::ParseError& error, const CLI::App& app, int argc,
                       const char* const* argv) {
  std::vector<std::string> verbs, options;
  for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    verbs.push_back(sub->get_name());
    if (argc > 1 && sub->get_name() == argv[1]) {
      for (const auto* option : sub->get_options()) {
        for (const auto& name : option->get_lnames()) options.push_back("--" + name);
      }
    }
  }
  std::string line = error.what();
  if (argc < 2) return "found no verb, expected one of those `lamina --help` lists";
  if (std::find(verbs.begin(), verbs.end(), argv[1]) == verbs.end()) {
    const std::string near = nearest(argv[1], verbs);
    line = "found the unknown verb '" + std::string(argv[1]) + "', expected " +
           (near.empty() ? "one of those `lamina --help` lists" : "'" + near + "'?");
    return line;
  }
  for (int i = 2; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--", 0) != 0) continue;
    const std::string name = word.substr(0, word.find('='));
    if (std::find(options.begin(), options.end(), name) != options.end()) continue;
    const std::string near = nearest(name, options);
    if (!near.empty()) return "found the unknown option '" + name + "', expected '" + near + "'?";
  }
  line = line.substr(0, line.find('\n'));
  // CLI11's own words say what is wrong; where to look for what is right is added.
  const std::string verb = argv[1];
  return verb + ": found that " + line + ", expected what `lamina " + verb + " --help` says";
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

}  // namespace

int run(int argc, const char* const* argv) {
  // Sparse solvers below sum in the order of their threads: one keeps the bytes the same anywhere.
  omp_set_num_threads(1);
  // A file larger than the system allows is an error of writing, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app{"Planes, floors and trajectories from depth cameras, stereo and 2D lidars",
               "lamina"};
  app.require_subcommand(1);
  app.set_version_flag("--version", "lamina " LAMINA_VERSION);
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
      if (sub->parsed()) return action();
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
