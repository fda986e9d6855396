# Gives a bash shell roslaunch, rosrun and rostest for dr_eureka: . scripts/env.bash
# (scripts/setup, scripts/play or scripts/test must have run once.)

dr_eureka_made=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)/build
if [[ ! -f $dr_eureka_made/devel/setup.bash ]]; then
  echo "env.bash: $dr_eureka_made/devel/setup.bash is missing; run scripts/setup first" >&2
  unset dr_eureka_made
  return 1
fi

# Debian's hooks use variables that need not be set.
case $- in *u*) dr_eureka_nounset=1 ;; *) dr_eureka_nounset= ;; esac
set +u
. "$dr_eureka_made/devel/setup.bash"
case ":$PATH:" in *":$dr_eureka_made/venv/bin:"*) ;; *) PATH=$dr_eureka_made/venv/bin:$PATH ;; esac
export PATH
# What nodes and roslaunch say on stdout and on stderr then stands in the order in which it was said, in files too.
export PYTHONUNBUFFERED=1

# With a master on this machine keep all of ROS on the loopback interface: nothing then depends on how the host's name
# resolves, and nobody else can command the robot.
if [[ -z ${ROS_HOSTNAME:-} && -z ${ROS_IP:-} && $ROS_MASTER_URI =~ ^http://(localhost|127\.[0-9.]+)[:/] ]]; then
  export ROS_HOSTNAME=localhost
fi

[[ -z $dr_eureka_nounset ]] || set -u
unset dr_eureka_made dr_eureka_nounset
