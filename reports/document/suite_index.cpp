// SPDX-License-Identifier: BSD-3-Clause
#include "document/suite_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <kainjow/mustache.hpp>
#include <set>
#include <stdexcept>

#include "document/codecs.h"
#include "figures/text.h"

namespace truebox {
namespace embedded {
extern const char* const kReportStyle;
extern const char* const kSuiteTemplate;
}  // namespace embedded

namespace {

using kainjow::mustache::data;

data list() { return data(data::type::list); }

std::string outcome_class(Agreement outcome) {
  return outcome == Agreement::not_run ? "fails" : to_text(outcome);
}

data card(const SuiteEntry& entry) {
  data d{data::type::object};
  d.set("name", entry.name);
  d.set("outcome", to_text(entry.outcome));
  d.set("outcome_class", outcome_class(entry.outcome));
  d.set("sentence", entry.sentence);
  d.set("page", entry.page);
  d.set("has_page", !entry.page.empty());
  std::string tags;
  data tag_list = list(), thumbnails = list();
  for (const std::string& tag : entry.tags) {
    tags += (tags.empty() ? "" : "\n") + tag;
    data t{data::type::object};
    t.set("tag", tag);
    tag_list << t;
  }
  d.set("tags", tags);
  d.set("tag_list", tag_list);
  for (const Panel& panel : entry.thumbnails) {
    data t{data::type::object};
    t.set("thumbnail_title", panel.title);
    t.set("alt", panel.alt);
    t.set("png", detail::base64_encode(panel.picture.png));
    t.set("width", std::to_string(panel.picture.width_px));
    t.set("height", std::to_string(panel.picture.height_px));
    thumbnails << t;
  }
  d.set("thumbnails", thumbnails);
  return d;
}

}  // namespace

std::string to_suite_html(const std::string& title, const Verdict& verdict,
                          const std::vector<SuiteEntry>& entries) {
  std::vector<const SuiteEntry*> sorted;
  std::set<std::string> tags;
  for (const SuiteEntry& entry : entries) {
    sorted.push_back(&entry);
    tags.insert(entry.tags.begin(), entry.tags.end());
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const SuiteEntry* a, const SuiteEntry* b) {
    return a->outcome != b->outcome ? a->outcome > b->outcome : a->nearness > b->nearness;
  });
  data page{data::type::object};
  page.set("title", title);
  page.set("outcome", to_text(verdict.outcome));
  page.set("outcome_class", outcome_class(verdict.outcome));
  page.set("verdict_sentence", verdict.sentence);
  page.set("style", embedded::kReportStyle);
  data cards = list(), all_tags = list(), outcomes = list();
  for (const SuiteEntry* entry : sorted) cards << card(*entry);
  for (const std::string& tag : tags) {
    data t{data::type::object};
    t.set("tag", tag);
    all_tags << t;
  }
  for (Agreement a :
       {Agreement::fails, Agreement::not_run, Agreement::warning, Agreement::agrees}) {
    data o{data::type::object};
    o.set("option", to_text(a));
    o.set("count", std::to_string(
                       std::count_if(entries.begin(), entries.end(),
                                     [a](const SuiteEntry& entry) { return entry.outcome == a; })));
    outcomes << o;
  }
  page.set("cards", cards);
  page.set("all_tags", all_tags);
  page.set("has_tags", !tags.empty());
  page.set("outcomes", outcomes);
  kainjow::mustache::mustache text(embedded::kSuiteTemplate);
  text.set_custom_escape([](const std::string& t) { return xml_escape(t); });
  if (!text.is_valid()) throw std::logic_error("suite.mustache: " + text.error_message());
  return text.render(page);
}

}  // namespace truebox
