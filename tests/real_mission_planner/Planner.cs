// SPDX-License-Identifier: GPL-3.0-or-later
// A pilot at Mission Planner. Reads a command from each line of standard input, ends each with a line "done".

using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Reflection;
using System.Threading;
using MissionPlanner.GCSViews;
using MissionPlanner.Utilities;

namespace MissionPlanner {
    public static class Planner {
        static readonly Dictionary<string, Window> windows = new Dictionary<string, Window> {
            { "FlightData", new FlightData() }, { "FlightPlanner", FlightPlanner.instance },
            { "ConfigAccelerometerCalibration", new ConfigAccelerometerCalibration() },
            { "ConfigHWCompass2", new ConfigHWCompass2() },
            { "PrearmStatus", new PrearmStatus() } };
        static MAVState Vehicle => MainV2.comPort.MAV;

        static void Main() {
            CultureInfo.DefaultThreadCurrentCulture = Thread.CurrentThread.CurrentCulture = CultureInfo.InvariantCulture;
            Settings.Instance["speechenable"] = "True";
            new Thread(Watch) { IsBackground = true }.Start();
            for (string line; (line = Console.ReadLine()) != null;) {
                try { Obey(line.Split('\t')); }
                catch (Exception error) { Screen.Tell("error", error.ToString()); }
                Screen.Tell("done", line);
            }
            Environment.Exit(0);
        }

        static void Obey(string[] words) {
            switch (words[0]) {
                case "connect": MainV2.instance.Connect(int.Parse(words[1])); break;
                case "refuse": Screen.Refused = words[1]; break;
                case "answer": Screen.Answer = words[1]; break;
                case "joystick": Joystick(int.Parse(words[1])); break;
                case "press": Press(windows[words[1]], words[2]); break;
                case "choose": Choose(windows[words[1]], words[2], words[3]); break;
                case "plan": FlightPlanner.instance.Rows = words.Skip(1).Select(Item).ToList(); break;
                case "parameters":
                    foreach (var each in Vehicle.param) Screen.Tell("parameter", $"{each.Name} {each.Value:R}");
                    break;
                case "set": Set(words[1], double.Parse(words[2])); break;
                case "state":
                    foreach (var name in words.Skip(1)) {
                        var property = typeof(CurrentState).GetProperty(name);
                        Screen.Tell("state", name + " " + Convert.ToString(property.GetValue(Vehicle.cs), CultureInfo.InvariantCulture));
                    }
                    break;
                default: throw new ArgumentException(words[0]);
            }
        }

        /// The sticks at 20 Hz, as joysticksend of MainV2.
        static void Joystick(int times) {
            for (; times > 0; times--, Thread.Sleep(50))
                MainV2.comPort.sendPacket(new MAVLink.mavlink_rc_channels_override_t {
                    target_system = Vehicle.sysid, target_component = Vehicle.compid,
                    chan1_raw = 1500, chan2_raw = 1500, chan3_raw = 1200, chan4_raw = 1500 }, Vehicle.sysid, Vehicle.compid);
        }

        /// Full Parameter List, Write: as BUT_writePIDS_Click of ConfigRawParams.
        static void Set(string name, double value) {
            try {
                MainV2.comPort.setParam(name, value);
                Screen.Dialog("1 parameters successfully saved.", "Saved");
            }
            catch { Screen.Dialog("Set " + name + " Failed", ""); }
        }

        static void Press(Window window, string handler) {
            var found = window.GetType().GetMethod(handler, BindingFlags.Instance | BindingFlags.NonPublic | BindingFlags.Public);
            found.Invoke(window, new object[] { new Control(), EventArgs.Empty });
        }

        static void Choose(Window window, string name, string value) {
            var field = window.GetType().GetField(name, BindingFlags.Instance | BindingFlags.NonPublic | BindingFlags.Public);
            var control = (Control)field.GetValue(window);
            control.Text = value;
            if (name == "cmb_missiontype") control.SelectedValue = Enum.Parse(typeof(MAVLink.MAV_MISSION_TYPE), value);
            int.TryParse(value, out control.SelectedIndex);
            if (control is FlightData.Number number) number.Value = decimal.Parse(value);
        }

        /// command frame param1 ... param4 latitude longitude altitude
        static Locationwp Item(string text) {
            var v = text.Split(' ').Select(each => double.Parse(each, CultureInfo.InvariantCulture)).ToArray();
            return new Locationwp { id = (ushort)v[0], frame = (byte)v[1], p1 = (float)v[2], p2 = (float)v[3],
                p3 = (float)v[4], p4 = (float)v[5], lat = v[6], lng = v[7], alt = (float)v[8] };
        }

        /// What the HUD, the Messages tab and the toolbar show, whenever it changes.
        static void Watch() {
            var shown = new Dictionary<string, string>();
            DateTime lastMessage = DateTime.MinValue;
            for (;; Thread.Sleep(50)) {
                try {
                    var cs = Vehicle.cs;
                    if (!cs.connected) continue;
                    foreach (var each in cs.messages.ToArray().Where(each => each.time > lastMessage)) {
                        lastMessage = each.time;
                        Screen.Tell("message", each.message);
                    }
                    var now = new Dictionary<string, object> {
                        { "line", cs.messageHigh }, { "ready", cs.prearmstatus }, { "armed", cs.armed }, { "failsafe", cs.failsafe },
                        { "safe", cs.safetyactive }, { "mode", cs.mode }, { "link", cs.linkqualitygcs / 10 * 10 }, { "wp", cs.wpno },
                        { "severity", cs.messageHigh == "" ? "" : cs.messageHighSeverity.ToString() } };
                    foreach (var each in now) {
                        string text = "" + each.Value;
                        if (shown.TryGetValue(each.Key, out string old) && old == text) continue;
                        shown[each.Key] = text;
                        Screen.Tell(each.Key, text);
                    }
                }
                catch (Exception) {}  // another thread has changed a list meanwhile
            }
        }
    }
}
