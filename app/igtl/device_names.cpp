// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/device_names.hpp"

#include <set>

#include "app/igtl/message.hpp"

namespace ecorche::app::igtl {

std::vector<std::string> device_names(const std::vector<std::string>& names) {
  constexpr std::size_t end_bytes = 10;
  std::set<std::string> taken;
  for (const std::string& name : names) {
    if (name.size() <= kDeviceBytes) taken.insert(name);
  }
  std::vector<std::string> out;
  for (const std::string& name : names) {
    std::string fitting = name;
    for (std::size_t number = 0;
         fitting.size() > kDeviceBytes || (fitting != name && !taken.insert(fitting).second); ++number) {
      const std::string mark = number == 0 ? "~" : std::to_string(number) + "~";
      fitting = name.substr(0, kDeviceBytes - end_bytes - mark.size()) + mark +
                name.substr(name.size() - end_bytes);
    }
    out.push_back(fitting);
  }
  return out;
}

}  // namespace ecorche::app::igtl
